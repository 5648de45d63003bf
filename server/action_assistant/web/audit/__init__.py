"""The audit: who did what, when and from where, over the events that a process stores anyway."""
