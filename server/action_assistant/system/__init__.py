"""Facts of the computer that this program runs on, and faults that it may have."""
