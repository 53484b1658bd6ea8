"""How much of the drive model's bounds the autopilot's own measured corners left unused; no calibration goes below them."""

from __future__ import annotations

from typing import Final

LEAST_MORE_M: Final = {
    ("ackermann", 0, 2): (-0.107, -0.082),
    ("ackermann", 0, 4): (-0.142, -0.118),
    ("ackermann", 1, 2): (-0.105, -0.066),
    ("ackermann", 1, 4): (-0.048, -0.02),
    ("ackermann", 1, 10): (-0.055, 0.0),
    ("ackermann", 2, 2): (-0.075, -0.029),
    ("ackermann", 2, 10): (-0.05, 0.0),
    ("ackermann", 3, 10): (-0.059, 0.0),
    ("ackermann", 4, 4): (0.0, -0.012),
    ("ackermann", 4, 10): (-0.061, 0.0),
    ("ackermann", 5, 2): (-0.024, 0.0),
    ("ackermann", 5, 4): (0.0, -0.002),
    ("ackermann", 5, 10): (-0.001, 0.0),
    ("ackermann", 6, 2): (-0.042, 0.0),
    ("ackermann", 6, 4): (-0.021, -0.033),
    ("ackermann", 6, 10): (-0.032, 0.0),
    ("ackermann", 7, 2): (-0.093, 0.0),
    ("ackermann", 7, 4): (-0.241, -0.121),
    ("ackermann", 7, 10): (-0.072, 0.0),
    ("ackermann", 8, 2): (-0.121, 0.0),
    ("ackermann", 8, 4): (-0.182, -0.123),
    ("ackermann", 8, 10): (-0.112, -0.147),
    ("ackermann", 9, 2): (-0.146, -0.037),
    ("ackermann", 9, 4): (-0.328, 0.0),
    ("ackermann", 9, 10): (-0.116, -0.099),
    ("ackermann", 10, 2): (-0.187, -0.18),
    ("ackermann", 10, 4): (-0.176, -0.247),
    ("ackermann", 10, 10): (-0.054, -0.134),
    ("ackermann", 11, 2): (-0.144, -0.037),
    ("ackermann", 11, 4): (-0.236, -0.164),
    ("ackermann", 11, 10): (0.0, -0.073),
    ("skid", 0, 2): (-0.121, -0.103),
    ("skid", 0, 4): (-0.143, -0.128),
    ("skid", 0, 6): (-0.088, -0.044),
    ("skid", 1, 2): (-0.113, -0.088),
    ("skid", 1, 4): (-0.05, -0.026),
    ("skid", 1, 6): (-0.085, -0.054),
    ("skid", 2, 2): (-0.099, -0.067),
    ("skid", 2, 6): (-0.057, -0.053),
    ("skid", 3, 2): (0.0, -0.039),
    ("skid", 3, 6): (0.0, -0.056),
    ("skid", 4, 2): (-0.002, 0.0),
    ("skid", 4, 4): (-0.241, 0.0),
    ("skid", 4, 6): (-0.141, 0.0),
}
"""By steering, class of angle (15°) and class of speed (0.5 m/s): how far the widest row stayed within its bound inside and outside, in metres, negative; from
`python benchmarks/drive_model.py --left-unused` over benchmarks/data, classes of 16 rows and more that the rover drives through. Others have nothing to spare."""
