# What sourcing ROS 2 sets, for wheels that lie where the distribution has its packages.
_packages=$(echo /opt/ros/jazzy/lib/python3.*/site-packages)
_libraries=/opt/ros/jazzy/lib
for _folder in "$_packages"/*.libs; do _libraries=$_libraries:$_folder; done
export AMENT_PREFIX_PATH="/opt/ros/jazzy${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}"
export CMAKE_PREFIX_PATH="/opt/ros/jazzy${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}"
export LD_LIBRARY_PATH="$_libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export PATH="/opt/ros/jazzy/bin:$PATH"
export PYTHONPATH="$_packages${PYTHONPATH:+:$PYTHONPATH}"
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
unset _packages _libraries _folder
