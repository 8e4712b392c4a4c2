# `plugins` is generated into the devel space, and `control_msgs` lies within another package: no path leads to either.
for folder in "@(SOURCES_OF_PACKAGES)" "@(CATKIN_DEVEL_PREFIX)/share"; do
  case ":$ROS_PACKAGE_PATH:" in
    *":$folder:"*) ;;
    *) [ -z "$folder" ] || export ROS_PACKAGE_PATH="$folder:$ROS_PACKAGE_PATH" ;;
  esac
done
unset folder
