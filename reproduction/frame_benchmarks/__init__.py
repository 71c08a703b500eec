"""Published benchmarks of frames under large displacements, and their exact solutions."""
