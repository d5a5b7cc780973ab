"""The words for other tools: every file is made from the declared formats, with the same bytes on every machine."""
