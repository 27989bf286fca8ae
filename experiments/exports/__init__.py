"""What was identified, for other software: robot files, base parameters, a function for a controller."""
