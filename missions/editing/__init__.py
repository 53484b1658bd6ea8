"""Missions changed: repaired around fences, and shortened to what a vehicle holds."""
