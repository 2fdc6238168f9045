//! Design of quad layouts on triangle meshes by weaving dual strips (Campen, Quad Layouts).
//!
//! Loops are placed on a mesh (`elastica` finds them, `weave` holds the design); the cells of their arrangement (`dual`) are
//! the nodes of a quad layout (`layout`); the layout is embedded in the surface and its embedding optimised (`embed`, on the
//! cross fields of `field` and the seamless maps of `param`); at last quads are extracted (`quad`). The library has no user
//! interface and no global state. Modules depend on each other in one direction, from `solve` and `mesh` to `weave`.

pub mod dual;
pub mod elastica;
pub mod embed;
pub mod field;
pub mod layout;
pub mod mesh;
pub mod output;
pub mod param;
pub mod progress;
pub mod proxy;
pub mod quad;
pub mod solve;
pub mod strip;
pub mod surface;
#[cfg(test)]
pub(crate) mod testing;
mod union_find;
pub mod weave;
