//! isoswarm-geometry
