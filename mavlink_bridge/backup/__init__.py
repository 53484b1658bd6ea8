"""What was on a vehicle before it was overwritten, which vehicle that is, and who writes to it."""
