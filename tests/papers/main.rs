//! The papers' figures and claims about control points, as tests: WH94 is Witkin and Heckbert, SIGGRAPH '94, HBJF02 Hart,
//! Bachta, Jarosz and Fleury, SMI 2002. Each figure is a scene and a script in `models/`; `pictures.rs` draws them.

mod hbjf02;
mod story;
mod wh94;
