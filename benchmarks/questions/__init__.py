"""Questions: each file asks one, of busflow and of its peers, and has it as `QUESTION`."""
