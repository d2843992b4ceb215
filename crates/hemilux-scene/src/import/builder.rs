//! The state that pbrt's directives change, and the scene that grows from it.

use super::colour::ColourSpace;
use super::params::{Param, Params, TextureNames};
use super::parser::MAX_NESTING;
use super::{Env, transform};
use crate::geom::{DAffine3, DVec3};
use crate::{
    Camera, Emission, Environment, Film, Filter, ImageId, Instance, Material, MaterialId, MaterialKind, Mesh,
    Object, Profile, Rgb, RgbParam, Shape, Span, Texture, TextureImage,
};
use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;

/// Parameters that `Attribute` may set at once.
const MAX_ATTRIBUTES: usize = 1000;

/// What `AreaLightSource` says about the shapes that follow.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// As if uniform and one-sided.
    pub emission: Emission,
    /// Total power (W), instead of radiance.
    pub power: Option<f64>,
    /// Where.
    pub span: Span,
}

/// What `Attribute` sets for later directives.
#[derive(Clone, Debug, Default)]
pub struct Attributes {
    pub shape: Vec<Param>,
    pub light: Vec<Param>,
    pub material: Vec<Param>,
    pub texture: Vec<Param>,
    pub medium: Vec<Param>,
}

/// pbrt's graphics state.
#[derive(Clone, Debug)]
pub struct State {
    /// Current transformation matrix: local to world.
    pub ctm: DAffine3,
    /// `ReverseOrientation`.
    pub reverse: bool,
    /// Of the shapes that follow.
    pub material: MaterialId,
    /// Of the shapes that follow.
    pub area_light: Option<Rc<AreaLight>>,
    /// In which RGB values are meant.
    pub space: ColourSpace,
    /// `Attribute`.
    pub attributes: Rc<Attributes>,
    /// `ActiveTransform EndTime`: transformations do not count.
    pub frozen: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockKind {
    Attribute,
    Transform,
    Object,
}

impl BlockKind {
    fn name(self) -> &'static str {
        match self {
            BlockKind::Attribute => "Attribute",
            BlockKind::Transform => "Transform",
            BlockKind::Object => "Object",
        }
    }
}

#[derive(Debug)]
struct Block {
    kind: BlockKind,
    span: Span,
    saved: State,
}

/// A material name: its slot, and whether the file has defined it yet.
#[derive(Debug)]
pub struct NamedMaterial {
    pub id: MaterialId,
    pub defined: bool,
    /// Of the definition or the first use.
    pub span: Span,
}

/// A luminaire without extent, to become a sphere when the size of the scene is known.
#[derive(Debug)]
pub struct PointLight {
    pub position: DVec3,
    /// W·sr⁻¹ where the profile is 1.
    pub intensity: Rgb,
    pub profile: Profile,
    pub span: Span,
}

/// A scene under construction.
#[derive(Debug)]
pub struct Builder {
    pub env: Rc<Env>,
    pub state: State,
    blocks: Vec<Block>,
    pub in_world: bool,
    too_deep: bool,
    /// The first directive that came before WorldBegin and must not.
    pub premature: Option<(String, Span)>,
    coordinate_systems: HashMap<String, DAffine3>,

    pub camera: Option<Camera>,
    pub film: Option<(Film, Span)>,
    pub filter: Option<Filter>,
    pub exposure_time: f64,
    pub samples_per_pixel: Option<u32>,
    pub max_depth: Option<u32>,
    pub textures: Vec<Texture>,
    pub float_textures: TextureNames,
    pub spectrum_textures: TextureNames,
    pub images: Vec<TextureImage>,
    pub image_ids: HashMap<(PathBuf, String), ImageId>,
    pub materials: Vec<Material>,
    pub named_materials: HashMap<String, NamedMaterial>,
    /// Materials that another took the place of.
    pub replaced: HashMap<MaterialId, MaterialId>,
    pub media: HashMap<String, bool>,
    pub meshes: Vec<Mesh>,
    pub shapes: Vec<Shape>,
    pub objects: Vec<Object>,
    pub object_names: HashMap<String, (u32, Span)>,
    /// Index of the object being defined.
    pub current_object: Option<u32>,
    pub instances: Vec<Instance>,
    /// Instances by name, where they are placed, resolved at the end.
    pub placements: Vec<(String, DAffine3, Span)>,
    pub environments: Vec<Environment>,
    pub point_lights: Vec<PointLight>,
    pub degenerate: usize,
    pub degenerate_span: Span,
}

impl Builder {
    pub fn new(env: Rc<Env>) -> Self {
        let default_material = Material {
            kind: MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::splat(0.5)) },
            bump: None,
            normal_map: None,
            name: String::new(),
            span: Span::default(),
        };
        Builder {
            env,
            state: initial_state(),
            blocks: Vec::new(),
            in_world: false,
            too_deep: false,
            premature: None,
            coordinate_systems: HashMap::new(),
            camera: None,
            film: None,
            filter: None,
            exposure_time: 1.0,
            samples_per_pixel: None,
            max_depth: Some(5),
            textures: Vec::new(),
            float_textures: HashMap::new(),
            spectrum_textures: HashMap::new(),
            images: Vec::new(),
            image_ids: HashMap::new(),
            materials: vec![default_material],
            named_materials: HashMap::new(),
            replaced: HashMap::new(),
            media: HashMap::new(),
            meshes: Vec::new(),
            shapes: Vec::new(),
            objects: Vec::new(),
            object_names: HashMap::new(),
            current_object: None,
            instances: Vec::new(),
            placements: Vec::new(),
            environments: Vec::new(),
            point_lights: Vec::new(),
            degenerate: 0,
            degenerate_span: Span::default(),
        }
    }

    /// The options are over. `fresh`: the file's own WorldBegin; otherwise the state of the file before goes on.
    pub fn world_begin(&mut self, fresh: bool) {
        if fresh || !self.in_world {
            let space = self.state.space;
            self.state = State { space, attributes: self.state.attributes.clone(), ..initial_state() };
        }
        self.in_world = true;
        self.coordinate_systems.insert("world".into(), DAffine3::IDENTITY);
    }

    /// Whether the world has begun; remembers the first directive that should have waited for it.
    pub fn require_world(&mut self, directive: &str, at: Span) -> bool {
        if !self.in_world && self.premature.is_none() {
            self.premature = Some((directive.to_owned(), at));
        }
        self.in_world
    }

    /// Whether the options are still open.
    pub fn require_options(&self, directive: &str, at: Span) -> bool {
        if self.in_world {
            self.env.log.error(at, format!("{directive} must come before WorldBegin"));
        }
        !self.in_world
    }

    // Transformations.

    /// Replace the transformation matrix.
    pub fn set_transform(&mut self, m: DAffine3, at: Span) {
        if self.state.frozen {
            return;
        }
        if transform::is_invertible(&m) {
            self.state.ctm = m;
        } else {
            self.env.log.error(at, "singular transform");
        }
    }

    /// Apply `m` before what is current.
    pub fn concat(&mut self, m: DAffine3, at: Span) {
        self.set_transform(self.state.ctm * m, at);
    }

    pub fn rotate(&mut self, [degrees, x, y, z]: [f64; 4], at: Span) {
        match transform::rotate(degrees, DVec3::new(x, y, z)) {
            Some(m) => self.concat(m, at),
            None => self.env.log.error(at, "Rotate around a zero axis"),
        }
    }

    pub fn look_at(&mut self, v: [f64; 9], at: Span) {
        let point = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
        match transform::look_at(point(0), point(3), point(6)) {
            Some(m) => self.concat(m, at),
            None => self.env.log.error(at, "LookAt: the eye, the point looked at and up must not be in line"),
        }
    }

    pub fn matrix(&mut self, v: &[f64; 16], concat: bool, at: Span) {
        match transform::from_columns(v) {
            Some(m) if concat => self.concat(m, at),
            Some(m) => self.set_transform(m, at),
            None => self.env.log.error(at, "the last row of a transform must be 0 0 0 1"),
        }
    }

    pub fn coordinate_system(&mut self, name: String, define: bool, span: Span) {
        if define {
            self.coordinate_systems.insert(name, self.state.ctm);
        } else if let Some(&m) = self.coordinate_systems.get(&name) {
            self.set_transform(m, span);
        } else {
            let message = format!("coordinate system \"{name}\" is not defined");
            self.env.log.unknown_among(
                span,
                message,
                &name,
                self.coordinate_systems.keys().map(String::as_str),
            );
        }
    }

    /// Name the camera's frame, as pbrt does.
    pub fn name_camera_frame(&mut self, to_world: DAffine3) {
        self.coordinate_systems.insert("camera".into(), to_world);
    }

    // Blocks.

    /// Number of open blocks.
    pub fn depth(&self) -> usize {
        self.blocks.len()
    }

    pub fn open(&mut self, kind: BlockKind, at: Span) {
        if self.blocks.len() >= MAX_NESTING {
            if !self.too_deep {
                self.env.log.error(at, format!("blocks nested deeper than {MAX_NESTING}"));
            }
            self.too_deep = true;
            return;
        }
        self.blocks.push(Block { kind, span: at, saved: self.state.clone() });
    }

    pub fn close(&mut self, kind: BlockKind, at: Span) {
        if self.too_deep {
            return;
        }
        let name = kind.name();
        match self.blocks.last().map(|b| (b.kind, b.span)) {
            Some((k, _)) if k == kind => {
                if let Some(block) = self.blocks.pop() {
                    self.restore(block);
                }
            }
            Some((k, span)) => {
                let place = self.env.files.borrow().sources.locate(span);
                let message = format!("{name}End inside the {}Begin of {place}", k.name());
                self.env.log.error(at, message);
            }
            None => self.env.log.error(at, format!("{name}End without {name}Begin")),
        }
    }

    fn restore(&mut self, block: Block) {
        match block.kind {
            BlockKind::Transform => {
                self.state.ctm = block.saved.ctm;
                self.state.frozen = block.saved.frozen;
            }
            BlockKind::Attribute => self.state = block.saved,
            BlockKind::Object => {
                self.state = block.saved;
                self.current_object = None;
            }
        }
    }

    /// A file ends: report the blocks above `depth` that it left open.
    pub fn close_blocks(&mut self, depth: usize) {
        let mut reported = self.too_deep;
        while self.blocks.len() > depth {
            let Some(block) = self.blocks.pop() else { return };
            if !reported {
                let name = block.kind.name();
                self.env.log.error(block.span, format!("{name}Begin without {name}End"));
                reported = true;
            }
            self.restore(block);
        }
    }

    // Objects.

    pub fn object_begin(&mut self, name: String, at: Span, span: Span) {
        if !self.require_world("ObjectBegin", at) {
            self.open(BlockKind::Object, at);
            return;
        }
        if self.current_object.is_some() {
            self.env.log.error(at, "ObjectBegin inside another object");
        } else if let Some((_, first)) = self.object_names.get(&name) {
            let place = self.env.files.borrow().sources.locate(*first);
            self.env.log.error(span, format!("object \"{name}\" is already defined at {place}"));
        } else {
            let id = self.objects.len() as u32;
            self.object_names.insert(name.clone(), (id, span));
            self.objects.push(Object { name, shapes: Vec::new() });
            self.current_object = Some(id);
        }
        self.open(BlockKind::Object, at);
    }

    pub fn object_instance(&mut self, name: String, at: Span, span: Span) {
        if !self.require_world("ObjectInstance", at) {
            return;
        }
        if self.current_object.is_some() {
            self.env.log.error(at, "ObjectInstance inside an object");
            return;
        }
        self.placements.push((name, self.state.ctm, span));
    }

    // Small directives.

    pub fn attribute(&mut self, target: &str, span: Span, items: Vec<Param>) {
        let attributes = Rc::make_mut(&mut self.state.attributes);
        let list = match target {
            "shape" => &mut attributes.shape,
            "light" => &mut attributes.light,
            "material" => &mut attributes.material,
            "texture" => &mut attributes.texture,
            "medium" => &mut attributes.medium,
            _ => {
                let known = ["shape", "light", "material", "texture", "medium"];
                let message = format!("unknown attribute target \"{target}\"");
                self.env.log.unknown_among(span, message, target, known);
                return;
            }
        };
        if list.len() + items.len() > MAX_ATTRIBUTES {
            self.env.log.error(span, format!("more than {MAX_ATTRIBUTES} attributes"));
            return;
        }
        for item in items {
            list.retain(|p| p.name != item.name);
            list.push(item);
        }
    }

    pub fn option(&mut self, params: Params) {
        params.ignore(&[
            "disablepixeljitter",
            "disabletexturefiltering",
            "disablewavelengthjitter",
            "displacementedgescale",
            "forcediffuse",
            "msereferenceimage",
            "msereferenceout",
            "pixelstats",
            "rendercoordsys",
            "seed",
            "wavefront",
        ]);
        params.finish(&self.env.log);
        for p in &params.items {
            if p.used.get() && p.name == "forcediffuse" {
                self.env.log.warning(p.span, "option \"forcediffuse\" is ignored");
            }
        }
    }

    pub fn make_named_medium(&mut self, name: &str, mut params: Params, _at: Span) {
        params.inherit(&self.state.attributes.medium);
        let kind = params.text(&self.env.log, "type").unwrap_or("").to_owned();
        params.ignore_all();
        let known = ["homogeneous", "uniformgrid", "rgbgrid", "cloud", "nanovdb"];
        if !known.contains(&kind.as_str()) {
            let span = params.value_span("type");
            self.env.log.unknown_among(span, format!("unknown medium \"{kind}\""), &kind, known);
        }
        self.media.insert(name.to_owned(), false);
    }

    pub fn medium_interface(&mut self, names: &[String], span: Span) {
        for name in names.iter().filter(|n| !n.is_empty()) {
            match self.media.get_mut(name) {
                Some(warned) if *warned => {}
                Some(warned) => {
                    *warned = true;
                    let message =
                        format!("medium \"{name}\" is ignored: nothing scatters or absorbs between surfaces");
                    self.env.log.warning(span, message);
                }
                None => {
                    let message = format!("medium \"{name}\" is not defined");
                    self.env.log.unknown_among(span, message, name, self.media.keys().map(String::as_str));
                }
            }
        }
    }

    /// Add a shape to the object being defined, or to the world.
    pub fn add_shape(&mut self, shape: Shape) {
        match self.current_object.and_then(|i| self.objects.get_mut(i as usize)) {
            Some(object) => object.shapes.push(shape),
            None => self.shapes.push(shape),
        }
    }
}

fn initial_state() -> State {
    State {
        ctm: DAffine3::IDENTITY,
        reverse: false,
        material: MaterialId(0),
        area_light: None,
        space: ColourSpace::default(),
        attributes: Rc::default(),
        frozen: false,
    }
}
