"""A class over HTTP and WebSockets: pupils' pages, the teacher's desk and the wall around `motorcade.classroom`."""
