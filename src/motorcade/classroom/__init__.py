"""A class in one room: who is here and who may do what, and the server of its pages."""
