# ros/temoto_msgs, as its generated classes look.
