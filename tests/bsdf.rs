//! Every BSDF draws what its density says, weighs it by its value, scatters no more than it gets, and is the same
//! seen from either end of a path.
