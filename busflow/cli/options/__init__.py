"""Options and arguments that several commands share. Prints no results."""
