"""What a word is: its fields, its image, its frame on the air, its way over a serial line. Portable and pure."""
