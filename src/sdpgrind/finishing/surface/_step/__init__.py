"""Reader of STEP files (ISO 10303-21): faces as B-spline patches with their trimming loops."""
