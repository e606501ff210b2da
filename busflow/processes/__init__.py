"""A run in several processes: what starts them, holds them back, watches over them, and makes one account of them."""
