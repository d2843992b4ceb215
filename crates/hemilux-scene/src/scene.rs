//! The scene as its files describe it: arenas of plain data that point at one another by index.

use crate::geom::{DAffine3, Vec2, Vec3};
use crate::{Rgb, Span};
use std::path::PathBuf;

/// Index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);
/// Index into [`Scene::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageId(pub u32);
/// Index into [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);
/// Index into [`Scene::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub u32);

/// Everything one render needs to know.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where from.
    pub camera: Camera,
    /// Onto what.
    pub film: Film,
    /// Pixel filter.
    pub filter: Filter,
    /// Samples per pixel that the file asks for.
    pub samples_per_pixel: Option<u32>,
    /// Path length limit of the file's integrator (`maxdepth`): the number of scattering events of a path.
    pub max_depth: Option<u32>,
    /// Textures; a texture refers to earlier ones only, so evaluation ends.
    pub textures: Vec<Texture>,
    /// Decoded images, linear.
    pub images: Vec<TextureImage>,
    /// Materials; a mix refers to earlier ones only.
    pub materials: Vec<Material>,
    /// Triangle meshes, in world space (those of [`Scene::shapes`]) or in their object's space.
    pub meshes: Vec<Mesh>,
    /// Shapes of the world.
    pub shapes: Vec<Shape>,
    /// Named groups of shapes that instances place.
    pub objects: Vec<Object>,
    /// Placed objects.
    pub instances: Vec<Instance>,
    /// What surrounds the scene: sky, sun.
    pub environments: Vec<Environment>,
    /// How radiometric values become photometric ones.
    pub photometry: Photometry,
    /// Every file that was read, for `info` and for the scene hash.
    pub files: Vec<PathBuf>,
    /// Hash of the contents of all files that were read (64-bit, stable across machines).
    pub content_hash: u64,
}

/// From three bands of radiometric values to photometric ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photometry {
    /// Luminous efficacy, lm/W.
    pub efficacy: f64,
    /// Weights of the bands; they sum to 1.
    pub weights: [f64; 3],
    /// Name of the convention.
    pub name: &'static str,
}

impl Photometry {
    /// CIE Y of linear sRGB and 683 lm/W.
    pub const CIE: Photometry =
        Photometry { efficacy: 683.0, weights: [0.2126, 0.7152, 0.0722], name: "CIE Y of sRGB, 683 lm/W" };
    /// Radiance's white light: 179 lm/W and its own weights.
    pub const RADIANCE: Photometry =
        Photometry { efficacy: 179.0, weights: [0.265, 0.670, 0.065], name: "Radiance, 179 lm/W" };

    /// The photometric value: lux of W·m⁻², cd·m⁻² of W·sr⁻¹·m⁻².
    pub fn luminous(&self, value: Rgb) -> f64 {
        self.efficacy * (0..3).map(|c| self.weights[c] * value[c] as f64).sum::<f64>()
    }
}

/// A number or a texture (its first band).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatParam {
    /// The same everywhere.
    Constant(f32),
    /// Varies over the surface.
    Texture(TextureId),
}

/// A spectral value or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RgbParam {
    /// The same everywhere.
    Constant(Rgb),
    /// Varies over the surface.
    Texture(TextureId),
}

/// A function over surfaces. Evaluates to [`Rgb`]; where a float is wanted, the first band counts.
#[derive(Clone, Debug)]
pub enum Texture {
    /// The same everywhere.
    Constant(Rgb),
    /// An image, bilinear, with `scale` and `invert` (1 − v) applied in that order.
    Image {
        /// The image.
        image: ImageId,
        /// From the surface to (s, t); t = 0 is the image's bottom row.
        mapping: TextureMapping,
        /// Outside [0, 1]².
        wrap: Wrap,
        /// Nearest texel instead of bilinear interpolation.
        nearest: bool,
        /// Factor.
        scale: f32,
        /// Take 1 − v after scaling.
        invert: bool,
    },
    /// Product of two.
    Scale(RgbParam, RgbParam),
    /// `(1 - amount) a + amount b`.
    Mix {
        /// At amount 0.
        a: RgbParam,
        /// At amount 1.
        b: RgbParam,
        /// Blend.
        amount: FloatParam,
    },
    /// Two values in turn by the parity of floor(s) + floor(t) (+ floor(r) in three dimensions).
    Checkerboard {
        /// Two-dimensional mapping; `None`: three-dimensional, by point.
        mapping: Option<TextureMapping>,
        /// World (or object) to texture space for the three-dimensional form.
        to_texture: DAffine3,
        /// Even cells.
        even: RgbParam,
        /// Odd cells.
        odd: RgbParam,
    },
}

/// From a surface point to texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureMapping {
    /// (u·su + du, v·sv + dv).
    Uv {
        /// Scales.
        scale: Vec2,
        /// Offsets.
        delta: Vec2,
    },
    /// (v1·p + d1, v2·p + d2), p in the space of `to_texture`.
    Planar {
        /// World to texture space.
        to_texture: DAffine3,
        /// First axis.
        v1: Vec3,
        /// Second axis.
        v2: Vec3,
        /// Offsets.
        delta: Vec2,
    },
    /// Angles (φ/2π, θ/π) around the origin of texture space.
    Spherical {
        /// World to texture space.
        to_texture: DAffine3,
    },
    /// (φ/2π, z) around the z axis of texture space.
    Cylindrical {
        /// World to texture space.
        to_texture: DAffine3,
    },
}

/// What lies outside an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Periodic.
    Repeat,
    /// Zero.
    Black,
    /// The nearest edge texel.
    Clamp,
}

/// A decoded image: linear values, row 0 on top.
#[derive(Clone, Debug)]
pub struct TextureImage {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// Row-major texels.
    pub texels: Vec<Rgb>,
    /// Opacity, if the file has it (row-major).
    pub alpha: Option<Vec<f32>>,
    /// Where it came from.
    pub path: PathBuf,
}

/// Microfacet roughness along the two tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Along dp/du.
    pub u: FloatParam,
    /// Along dp/dv.
    pub v: FloatParam,
    /// Whether the GGX α is the square root of the value (pbrt's `remaproughness`) or the value itself.
    pub remap: bool,
}

/// Reflectance of a bare conductor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Complex index of refraction.
    EtaK(RgbParam, RgbParam),
    /// Reflectance r at normal incidence: η = 1, k = 2√r/√(1−r).
    Reflectance(RgbParam),
}

/// How a surface scatters.
#[derive(Clone, Debug)]
pub enum MaterialKind {
    /// Lambertian reflection.
    Diffuse {
        /// Albedo in [0, 1].
        reflectance: RgbParam,
    },
    /// Metal, smooth or GGX.
    Conductor {
        /// Fresnel term.
        fresnel: ConductorFresnel,
        /// GGX roughness.
        roughness: Roughness,
    },
    /// Interface between two transparent media, smooth or GGX.
    Dielectric {
        /// Index inside (below the geometric normal) relative to outside.
        eta: f32,
        /// GGX roughness.
        roughness: Roughness,
    },
    /// A thin pane: both interfaces at once, no deviation.
    ThinDielectric {
        /// Index of the pane.
        eta: f32,
    },
    /// Varnish: a dielectric coat over a Lambertian base.
    CoatedDiffuse {
        /// Albedo of the base.
        reflectance: RgbParam,
        /// Index of the coat.
        eta: f32,
        /// GGX roughness of the coat.
        roughness: Roughness,
    },
    /// A dielectric coat over a conductor.
    CoatedConductor {
        /// Index of the coat.
        eta: f32,
        /// GGX roughness of the coat.
        coat_roughness: Roughness,
        /// Fresnel term of the base (index relative to the outside).
        fresnel: ConductorFresnel,
        /// GGX roughness of the base.
        base_roughness: Roughness,
    },
    /// Lambertian reflection and transmission.
    DiffuseTransmission {
        /// Albedo of reflection.
        reflectance: RgbParam,
        /// Albedo of transmission.
        transmittance: RgbParam,
        /// Factor on both.
        scale: f32,
    },
    /// `(1 - amount) a + amount b`.
    Mix {
        /// At amount 0.
        a: MaterialId,
        /// At amount 1.
        b: MaterialId,
        /// Blend in [0, 1].
        amount: FloatParam,
    },
    /// Given reflectances and transmittances rather than optical constants, from both sides (Radiance's `plastic`,
    /// `metal`, `trans` and `mirror`).
    Polished {
        /// Albedo of diffuse reflection.
        diffuse: Rgb,
        /// Mirror or rough reflectance.
        specular: Rgb,
        /// Albedo of diffuse transmission.
        diffuse_transmission: Rgb,
        /// Transmittance straight through, spread by half the roughness.
        specular_transmission: Rgb,
        /// Ward's roughness; 0 is smooth.
        alpha: f32,
        /// The mirror grows to 1 towards grazing angles, what is below it fades likewise (smooth surfaces only).
        fresnel: bool,
    },
    /// A thin pane of tinted glass: both interfaces and all inner reflections, no deviation.
    TintedPane {
        /// Index of the pane.
        eta: f32,
        /// Transmitted fraction of one passage at normal incidence, without the interfaces, in [0, 1].
        transmissivity: Rgb,
    },
    /// A smooth interface between media that absorb. The loss along a segment is taken where the segment ends on such
    /// an interface.
    TintedDielectric {
        /// Index inside (below the geometric normal) relative to outside.
        eta: f32,
        /// Transmitted fraction per metre inside, in [0, 1].
        inside: Rgb,
        /// Transmitted fraction per metre outside, in [0, 1].
        outside: Rgb,
    },
    /// No surface at all (a boundary of media): rays pass.
    Interface,
}

/// A material with what disturbs its shading frame.
#[derive(Clone, Debug)]
pub struct Material {
    /// How it scatters.
    pub kind: MaterialKind,
    /// Displacement (metres) whose slope tilts the shading normal.
    pub bump: Option<FloatParam>,
    /// Tangent-space normals, RGB in [0, 1] meaning 2v − 1.
    pub normal_map: Option<ImageId>,
    /// Name, empty when anonymous.
    pub name: String,
    /// Where it was made.
    pub span: Span,
}

/// A triangle mesh. Indices are in range; positions finite.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices (m).
    pub positions: Vec<Vec3>,
    /// Shading normals per vertex, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex, or empty.
    pub uvs: Vec<Vec2>,
    /// Triangles, counter-clockwise seen from the side the geometric normal points to.
    pub indices: Vec<[u32; 3]>,
}

/// Analytic surfaces in their own space, pbrt's parametrisation; angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quadric {
    /// x² + y² + z² = r², cut by z and φ.
    Sphere {
        /// Radius, > 0.
        radius: f64,
        /// Lowest z.
        z_min: f64,
        /// Highest z.
        z_max: f64,
        /// Largest φ, in (0, 2π].
        phi_max: f64,
    },
    /// A disk or ring at z = height.
    Disk {
        /// z.
        height: f64,
        /// Outer radius, > 0.
        radius: f64,
        /// Inner radius, ≥ 0.
        inner_radius: f64,
        /// Largest φ.
        phi_max: f64,
    },
    /// x² + y² = r² between two heights.
    Cylinder {
        /// Radius, > 0.
        radius: f64,
        /// Lowest z.
        z_min: f64,
        /// Highest z.
        z_max: f64,
        /// Largest φ.
        phi_max: f64,
    },
}

/// The geometry of a shape.
#[derive(Clone, Copy, Debug)]
pub enum Geometry {
    /// A mesh, already in the space of its group.
    Mesh(MeshId),
    /// A quadric and its placement in the space of its group.
    Quadric(Quadric, DAffine3),
}

/// Geometry with a material and perhaps emission.
#[derive(Clone, Debug)]
pub struct Shape {
    /// What.
    pub geometry: Geometry,
    /// How it scatters.
    pub material: MaterialId,
    /// Whether and how it emits.
    pub emission: Option<Emission>,
    /// Opacity in [0, 1]; rays pass with probability 1 − α.
    pub alpha: Option<FloatParam>,
    /// Flip the geometric normal.
    pub reverse_orientation: bool,
    /// Whether the placement mirrors (flips handedness): flips the geometric normal too.
    pub flips_handedness: bool,
    /// Name, empty where the file gives none.
    pub name: String,
    /// Where it was made.
    pub span: Span,
}

impl Shape {
    /// An opaque shape without a name, not turned inside out, that no file gave.
    #[must_use]
    pub fn new(geometry: Geometry, material: MaterialId, emission: Option<Emission>) -> Shape {
        Shape {
            geometry,
            material,
            emission,
            alpha: None,
            reverse_orientation: false,
            flips_handedness: false,
            name: String::new(),
            span: Span::default(),
        }
    }
}

/// Emission of an area luminaire. Emits on the side of the geometric normal.
#[derive(Clone, Debug)]
pub struct Emission {
    /// Emitted radiance, W·sr⁻¹·m⁻², before the factors below.
    pub radiance: Rgb,
    /// Image over (u, v) that multiplies it.
    pub image: Option<ImageId>,
    /// Also on the other side.
    pub two_sided: bool,
    /// Dependence on direction.
    pub profile: Profile,
}

/// Dependence of emitted radiance on direction; factors multiply [`Emission::radiance`].
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// None: Lambertian emitter.
    Uniform,
    /// A cone around `axis` (unit): 1 inside `cos_start`, smoothstep to 0 at `cos_end`.
    Spot {
        /// Axis, unit, space of the group.
        axis: Vec3,
        /// Cosine where the falloff begins.
        cos_start: f32,
        /// Cosine where it ends.
        cos_end: f32,
    },
    /// Intensity by direction from an equal-area octahedral image.
    Goniometric {
        /// The image.
        image: ImageId,
        /// World to the image's frame.
        to_local: DAffine3,
    },
    /// A projected image: perspective window around +z.
    Projection {
        /// The image.
        image: ImageId,
        /// World to the projector's frame.
        to_local: DAffine3,
        /// Half the window's size on the plane z = 1.
        half_window: Vec2,
    },
}

/// A named group of shapes.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name.
    pub name: String,
    /// Its shapes.
    pub shapes: Vec<Shape>,
}

/// A placed object.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Object to world, invertible.
    pub to_world: DAffine3,
}

/// What surrounds the scene.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere.
    Constant {
        /// W·sr⁻¹·m⁻².
        radiance: Rgb,
    },
    /// An image of all directions.
    Image {
        /// The image.
        image: ImageId,
        /// Factor on the texels to W·sr⁻¹·m⁻².
        scale: Rgb,
        /// How texels lie on the sphere.
        layout: EnvironmentLayout,
        /// Image frame to world (rotation).
        to_world: DAffine3,
        /// Only through this window (four corners, world), if given.
        portal: Option<[Vec3; 4]>,
    },
    /// A disk at infinity.
    Sun {
        /// Unit direction towards it.
        direction: Vec3,
        /// Cosine of its angular radius.
        cos_half_angle: f64,
        /// W·sr⁻¹·m⁻².
        radiance: Rgb,
    },
}

/// How an environment image covers the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvironmentLayout {
    /// pbrt-v4's equal-area octahedral map (Clarberg 2008), square.
    EqualAreaOctahedral,
    /// Latitude and longitude, z up.
    LatLong,
}

/// Where from, and by which projection.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Projection.
    pub projection: Projection,
    /// Camera (x right, y up, z forward; left-handed as in pbrt) to world.
    pub to_world: DAffine3,
    /// Window on the plane z = 1 in units of the shorter half axis: x0, x1, y0, y1; `None`: from the film's aspect.
    pub screen_window: Option<[f32; 4]>,
    /// Lens radius (m); 0: pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus (m).
    pub focal_distance: f32,
    /// Where it was made.
    pub span: Span,
}

/// How an architectural view maps directions to the plane of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewKind {
    /// Rectilinear; sizes are angles in degrees, in (0, 180).
    Perspective,
    /// Parallel; sizes are metres.
    Parallel,
    /// Hemispherical fisheye (orthographic projection of the sphere): r = sin θ; sizes are angles in (0, 180].
    Hemispherical,
    /// Angular fisheye (equidistant): r = θ; sizes are angles in (0, 360].
    Angular,
    /// Cylinder: across by angle, in (0, 360]; up and down rectilinear, in (0, 180).
    Cylindrical,
    /// Planisphere (stereographic): r = tan(θ/2); sizes are angles in (0, 360).
    Planisphere,
}

/// A view by kind and size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Projection.
    pub kind: ViewKind,
    /// Width of the picture: degrees, or metres of a parallel view.
    pub horizontal: f64,
    /// Height of the picture: degrees, or metres of a parallel view.
    pub vertical: f64,
    /// By how much of its width the picture is moved to the right.
    pub shift: f64,
    /// By how much of its height the picture is moved up.
    pub lift: f64,
    /// Where rays begin (m): distance from the eye, along the view direction for perspective and parallel views.
    pub fore: f64,
}

/// The camera's projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// An architectural view; width and height are its own, whatever the aspect of the film.
    View(View),
    /// Rectilinear; field of view across the shorter side of the film, degrees.
    Perspective {
        /// Field of view, degrees, in (0, 180).
        fov: f32,
    },
    /// Parallel.
    Orthographic,
    /// All directions; equirectangular or equal-area octahedral.
    Spherical {
        /// Equirectangular instead of equal-area.
        equirectangular: bool,
    },
}

/// What the picture falls on.
#[derive(Clone, Debug)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Part to render: x0, x1, y0, y1 in [0, 1].
    pub crop: [f32; 4],
    /// Factor from radiance to pixel value (pbrt's imaging ratio; 1 by default).
    pub scale: f32,
    /// File name the scene asks for.
    pub filename: Option<String>,
}

/// Pixel filter; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Constant.
    Box {
        /// Half widths.
        radius: Vec2,
    },
    /// Tent.
    Triangle {
        /// Half widths.
        radius: Vec2,
    },
    /// Gaussian minus its value at the rim.
    Gaussian {
        /// Half widths.
        radius: Vec2,
        /// Standard deviation, pixels.
        sigma: f32,
    },
    /// Mitchell–Netravali.
    Mitchell {
        /// Half widths.
        radius: Vec2,
        /// B.
        b: f32,
        /// C.
        c: f32,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        /// Half widths.
        radius: Vec2,
        /// τ.
        tau: f32,
    },
}
