"""What is asked: study files, their schema, cases and what identifies them."""
