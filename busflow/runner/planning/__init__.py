"""Planning: builds and declares the nodes of a graph, and finds everything wrong with it before anything starts.

Starts nothing. `preflight` plans a graph with `endpoints`, `supervision` and `programs`; `machine` and `credentials`
check the machine that it runs on, and `definitions` the files of its types.

Two pure functions of `drift` save parameters: `drifts(spec, values)` returns the current values that differ from the
launch file's, and `written_back(text, file, drifts)` returns the text that states them.
"""
