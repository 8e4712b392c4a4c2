# The package `plugins` is generated into the devel space, where no path to a source folder leads.
case ":$ROS_PACKAGE_PATH:" in
  *":@(CATKIN_DEVEL_PREFIX)/share:"*) ;;
  *) export ROS_PACKAGE_PATH="@(CATKIN_DEVEL_PREFIX)/share:$ROS_PACKAGE_PATH" ;;
esac
