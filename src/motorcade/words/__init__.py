"""What a word is: its fields, its image, its infrared frame, its upload over a serial line. Portable, without I/O."""
