"""What the notebooks of this course import beside the engine's functions: experiments, transforms, the clinic."""
