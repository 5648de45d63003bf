# The part of rcl_interfaces that this project uses.
