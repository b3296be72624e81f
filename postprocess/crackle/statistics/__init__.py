"""What follows from arrays, with formulas and sources; no module here knows a file."""
