"""Small parts that several packages use: each is written once, and knows nothing of the product."""
