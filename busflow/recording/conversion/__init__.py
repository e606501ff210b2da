"""What recordings are converted to: other programs' formats, and other ways to store a bag."""
