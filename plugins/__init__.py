"""The nodes of lab 1, written as a user would write them."""
