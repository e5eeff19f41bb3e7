"""Where the unknowns live: the mesh, its influence matrix, and the transfer between meshes."""
