//! isoswarm-particles
