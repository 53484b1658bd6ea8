"""The sans-IO client machines: uploads, downloads, parameters, commands; their tables stand in `transitions`."""
