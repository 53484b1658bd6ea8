"""What each command can be asked for: one module a command, which help needs and nothing more."""
