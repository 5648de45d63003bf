"""The command that writes C++ packages of actions, and writes them anew where people have worked."""
