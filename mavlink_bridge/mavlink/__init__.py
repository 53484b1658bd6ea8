"""MAVLink itself: messages, frames to bytes and back, signing, modes, how autopilots store items and tell parameters, who is heard."""
