"""Statement of a study: study files, their schema, and the cases that they define."""
