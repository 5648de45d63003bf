"""Stop: the messages, what proves rest, what happens without a proof."""
