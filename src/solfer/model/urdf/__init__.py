"""Description of a URDF: links, joints, the tree; cutting it, and writing it as Pinocchio needs it."""
