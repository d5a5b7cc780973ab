"""A laboratory for those who study swarms."""
