"""Drawn lines bent until the band that the vehicle is predicted to drive in keeps the promise."""
