"""Message and service types: fields, arrays, written constructors, and their encodings.

Knows no topic, no node and no process.
"""
