/** Which modes drive the mission and which hold, by the autopilot's own numbers: only for how the track looks. */

const ARDUPILOT = { auto: 10, hold: 4 }; // Rover's AUTO and HOLD
const PX4 = { auto: 0x04_04_00_00, hold: 0x03_04_00_00 }; // main mode AUTO with sub mode MISSION, LOITER

/**
 * @param {number | null} mode HEARTBEAT.custom_mode
 * @param {string} autopilot
 * @returns {"auto" | "hold" | "other"}
 */
export function lookOf(mode, autopilot) {
  const numbers = autopilot.toLowerCase().includes("px4") ? PX4 : ARDUPILOT;
  return mode === numbers.auto ? "auto" : mode === numbers.hold ? "hold" : "other";
}
