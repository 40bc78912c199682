//! isoswarm
