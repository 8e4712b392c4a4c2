"""The ground under the wheels: its plane, and its height."""
