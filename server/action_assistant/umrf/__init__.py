"""UMRF graphs: what a robot task is, how it is written, checked and executed. Pure."""
