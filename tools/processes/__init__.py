"""Work in processes of its own: pools of workers, and modules of this project."""
