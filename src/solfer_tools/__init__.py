"""Tools around the robot and its plugins: studies, pages, reviews of recordings, courses, and the demonstrations.

They import `solfer`; nothing of `solfer` imports them.
"""
