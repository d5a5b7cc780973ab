"""What a car does with a word: plain functions and classes that run on a computer and on a microcontroller."""
