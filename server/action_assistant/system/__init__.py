"""What this program asks of the computer that it runs on, and what may be wrong with that."""
