//! Control points: the surface follows particles (WH94 section 3.4, HBJF02 section 5).

mod factor;
