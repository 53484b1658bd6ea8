"""MAVLink itself: messages, frames to bytes and back, signing, modes, how autopilots store items and report parameters, who is heard."""
