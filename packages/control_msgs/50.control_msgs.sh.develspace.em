# It lies within the package solfer, where rospack does not look.
case ":$ROS_PACKAGE_PATH:" in
  *":@(PROJECT_SOURCE_DIR):"*) ;;
  *) export ROS_PACKAGE_PATH="@(PROJECT_SOURCE_DIR):$ROS_PACKAGE_PATH" ;;
esac
