"""What colcon said of the packages of actions."""
