"""A class in one room: who is here, who may do what, and in which order. Without I/O: time and chance are arguments."""
