//! What a picture should look like.

use std::str::FromStr;

use crate::GeometryError;

/// How the points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Style {
    /// Separate discs with rims, as in the figures of Witkin and Heckbert (1994): shows the sampling. What lies between
    /// them is [`PictureOptions::body`].
    Discs,
    /// Overlapping splats whose normals and colours blend: shows the surface.
    #[default]
    Surface,
    /// Balls, lit like discs that face the camera: shows bare points.
    Points,
}

/// How space becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Projection {
    /// Rays from one point.
    #[default]
    Perspective,
    /// Parallel rays: lengths can be measured in the picture.
    Parallel,
}

impl FromStr for Projection {
    type Err = GeometryError;

    /// `perspective` or `parallel`.
    fn from_str(name: &str) -> Result<Self, GeometryError> {
        match name {
            "perspective" => Ok(Self::Perspective),
            "parallel" => Ok(Self::Parallel),
            _ => Err(GeometryError::Option {
                name: "projection",
                expected: "`perspective` or `parallel`",
                given: format!("`{name}`"),
            }),
        }
    }
}

impl FromStr for Style {
    type Err = GeometryError;

    /// `discs`, `points` or `surface`.
    fn from_str(name: &str) -> Result<Self, GeometryError> {
        match name {
            "discs" => Ok(Self::Discs),
            "surface" => Ok(Self::Surface),
            "points" => Ok(Self::Points),
            _ => Err(GeometryError::Option {
                name: "style",
                expected: "`discs`, `points` or `surface`",
                given: format!("`{name}`"),
            }),
        }
    }
}

/// Where the colours come from. All colours are sRGB, each channel in 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coloring {
    /// One colour for the side that the normals point to, one for the other side.
    Uniform {
        /// Colour of the outside.
        front: [f64; 3],
        /// Colour of the inside.
        back: [f64; 3],
    },
    /// The cloud's own `colors`.
    Given,
    /// Mean curvature (k1 + k2) / 2 on a diverging map, clipped softly at the 90th percentile of its magnitude:
    /// positive is warm, negative cool, flat pale.
    Curvature,
    /// Height along `up` on a sequential map, from the lowest point to the highest.
    Height,
    /// The direction of the normal: x, y and z as red, green and blue, 0.5 for none.
    Normal,
}

impl Default for Coloring {
    fn default() -> Self {
        Self::Uniform { front: [0.27, 0.57, 0.72], back: [0.93, 0.64, 0.38] }
    }
}

impl FromStr for Coloring {
    type Err = GeometryError;

    /// `uniform` (the default colours), `given`, `curvature`, `height` or `normal`.
    fn from_str(name: &str) -> Result<Self, GeometryError> {
        match name {
            "uniform" => Ok(Self::default()),
            "given" => Ok(Self::Given),
            "curvature" => Ok(Self::Curvature),
            "height" => Ok(Self::Height),
            "normal" => Ok(Self::Normal),
            _ => Err(GeometryError::Option {
                name: "coloring",
                expected: "`uniform`, `given`, `curvature`, `height` or `normal`",
                given: format!("`{name}`"),
            }),
        }
    }
}

/// What lies behind the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// A vertical gradient of two sRGB colours.
    Gradient {
        /// Colour of the top row.
        top: [f64; 3],
        /// Colour of the bottom row.
        bottom: [f64; 3],
    },
    /// Nothing: alpha 0 where there is neither a point nor a shadow.
    Transparent,
}

impl Default for Background {
    fn default() -> Self {
        Self::Gradient { top: [0.99, 0.99, 0.985], bottom: [0.90, 0.915, 0.93] }
    }
}

/// Everything about a picture that is not in the cloud. `Default` is a good picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureOptions {
    /// Width in pixels, 1 to 16384. Default 1200.
    pub width: u32,
    /// Height in pixels, 1 to 16384. Default 900.
    pub height: u32,
    /// Where the camera stands: angle about `up` in radians, from the x axis towards y (for `up` = z). Default -1.05.
    pub azimuth: f64,
    /// Where the camera stands: angle above the horizon in radians, -π/2 to π/2. Default 0.4.
    pub elevation: f64,
    /// The direction that is up in the picture; any length but zero. Default z.
    pub up: [f64; 3],
    /// Vertical opening angle of the camera in radians, 0.05 to 2. Default 0.5. Framing is automatic.
    pub field_of_view: f64,
    /// Perspective or parallel rays. Default perspective.
    pub projection: Projection,
    /// Free space around the points, as a fraction of the half picture, 0 to 0.9. Default 0.1.
    pub margin: f64,
    /// Discs or surface. Default surface.
    pub style: Style,
    /// Where the colours come from. Default two colours, outside and inside.
    pub coloring: Coloring,
    /// What lies behind. Default a light gradient.
    pub background: Background,
    /// Factor on every radius, more than 0 up to 10. Default (`None`) 0.82 for discs, so that gaps show, and 1 for a surface.
    pub disc_scale: Option<f64>,
    /// Colour of the smooth surface that carries the discs and shows between them; `None` leaves the gaps open, so that
    /// one sees through. Default ivory. Discs with normals only.
    pub body: Option<[f64; 3]>,
    /// Width of each disc's dark rim as a fraction of its radius, 0 (none) to 1. Default 0.14. Discs only.
    pub outline: f64,
    /// How much hollows darken, 0 (not at all) to 1. Default 1.
    pub ambient_occlusion: f64,
    /// How dark cast shadows are, 0 (none) to 1. Default 0.8.
    pub shadow: f64,
    /// Whether the points stand on a ground that shows their shadow (seen from above only). Default true.
    pub ground: bool,
    /// Samples a pixel and direction, 1 (no antialiasing) to 4. Default 3, which is nine samples a pixel.
    pub supersampling: u32,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            width: 1200,
            height: 900,
            azimuth: -1.05,
            elevation: 0.4,
            up: [0.0, 0.0, 1.0],
            field_of_view: 0.5,
            projection: Projection::default(),
            margin: 0.1,
            style: Style::default(),
            coloring: Coloring::default(),
            background: Background::default(),
            disc_scale: None,
            body: Some([0.95, 0.94, 0.91]),
            outline: 0.14,
            ambient_occlusion: 1.0,
            shadow: 0.8,
            ground: true,
            supersampling: 3,
        }
    }
}

impl PictureOptions {
    /// Checks every option against the range in its documentation.
    ///
    /// # Errors
    /// [`GeometryError::Option`], naming the first option that is out of range.
    pub fn check(&self) -> Result<(), GeometryError> {
        let test = |name, expected, good, given: String| {
            if good { Ok(()) } else { Err(GeometryError::Option { name, expected, given }) }
        };
        let within = |name, expected, value: f64, low: f64, high: f64| {
            test(name, expected, (low..=high).contains(&value), value.to_string())
        };
        const SIZE: &str = "1 to 16384 pixels (draw tiles, or scale a smaller picture up)";
        test("width", SIZE, (1..=16384).contains(&self.width), self.width.to_string())?;
        test("height", SIZE, (1..=16384).contains(&self.height), self.height.to_string())?;
        test("azimuth", "a finite angle in radians", self.azimuth.is_finite(), self.azimuth.to_string())?;
        let right_angle = std::f64::consts::FRAC_PI_2;
        within("elevation", "an angle from -π/2 to π/2 radians", self.elevation, -right_angle, right_angle)?;
        let up = self.up.iter().all(|v| v.is_finite()) && self.up != [0.0; 3];
        test("up", "a finite vector that is not zero", up, format!("{:?}", self.up))?;
        within("field_of_view", "an angle from 0.05 to 2 radians", self.field_of_view, 0.05, 2.0)?;
        within("margin", "a fraction from 0 to 0.9", self.margin, 0.0, 0.9)?;
        let scale = self.disc_scale.unwrap_or(1.0);
        within("disc_scale", "a factor above 0, up to 10", scale, f64::MIN_POSITIVE, 10.0)?;
        within("outline", "a fraction from 0 to 1", self.outline, 0.0, 1.0)?;
        within("ambient_occlusion", "a strength from 0 to 1", self.ambient_occlusion, 0.0, 1.0)?;
        within("shadow", "a strength from 0 to 1", self.shadow, 0.0, 1.0)?;
        let supersampling = (1..=4).contains(&self.supersampling);
        test("supersampling", "1 to 4", supersampling, self.supersampling.to_string())?;
        let color = |name, c: [f64; 3]| {
            test(
                name,
                "sRGB channels from 0 to 1",
                c.iter().all(|v| (0.0..=1.0).contains(v)),
                format!("{c:?}"),
            )
        };
        if let Coloring::Uniform { front, back } = self.coloring {
            color("coloring.front", front)?;
            color("coloring.back", back)?;
        }
        if let Some(body) = self.body {
            color("body", body)?;
        }
        if let Background::Gradient { top, bottom } = self.background {
            color("background.top", top)?;
            color("background.bottom", bottom)?;
        }
        Ok(())
    }
}
