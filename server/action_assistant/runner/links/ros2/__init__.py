"""The link to engines over ROS 2, through rclpy."""
