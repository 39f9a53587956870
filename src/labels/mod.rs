//! Labels of images for training: poses, masks, key points, depth, parts and temperatures in the formats that others read.
//!
//! [`image`] is one image with everything known about it, and [`craft`] is the craft that it shows. [`from_scene`] makes both. [`places`] says which
//! file lies where. The writers return bytes or lines and write no file: [`bop`], [`speed`], [`coco`], [`yolo`], [`kitti`], [`webdataset`], [`hugging_face`], and [`maps`] for the images of
//! labels. [`label_target`] says which parts are which craft. [`describe`] has everything about one image, and [`conventions`] the text that a reader of the folder needs.
//!
//! Each list of a whole data set consists of entries of single images. An entry depends on its image and the craft alone, so shards make them in any order,
//! and whoever joins the shards only puts them between a head and an end.

pub(crate) mod bop;
pub(crate) mod coco;
pub(crate) mod conventions;
pub(crate) mod craft;
pub(crate) mod describe;
pub(crate) mod from_scene;
pub(crate) mod hugging_face;
pub(crate) mod image;
pub(crate) mod key_points;
pub(crate) mod kitti;
pub(crate) mod label_target;
pub(crate) mod made;
pub(crate) mod maps;
pub(crate) mod mask;
pub(crate) mod places;
pub(crate) mod ply;
pub(crate) mod silhouette;
pub(crate) mod speed;
pub(crate) mod symmetry;
pub(crate) mod text;
pub(crate) mod webdataset;
pub(crate) mod yolo;
