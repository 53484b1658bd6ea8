"""A fence laid out in the plane: where the vehicle may be, what stands near, and what is known to stop it there."""
