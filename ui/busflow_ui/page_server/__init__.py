"""The page of `busflow ui`: its files, the browsers that are let in, and what they look at: a run or a recording."""
