"""References for Isotherm that share no code with it: own meshes, rays of Embree, finite elements, radiosity and integrators."""
