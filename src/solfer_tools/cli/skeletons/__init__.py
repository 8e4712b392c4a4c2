"""First files of packages of users, from templates: components and robots."""
