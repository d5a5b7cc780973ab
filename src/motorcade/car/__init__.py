"""What a car does with a word. Portable and pure."""
