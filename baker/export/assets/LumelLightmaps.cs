// Hands the lightmaps of `lumel export --for unity` to Unity: Tools > Lumel > Apply lightmaps, once; afterwards the
// component does it whenever the scene loads.
using System;
using System.Collections.Generic;
using UnityEngine;

[ExecuteAlways]
public class LumelLightmaps : MonoBehaviour
{
    [Serializable]
    public struct Page { public Texture2D color; public Texture2D direction; }

    [Serializable]
    public struct Place { public Renderer renderer; public int page; public Vector4 scaleOffset; }

    public List<Page> pages = new List<Page>();
    public List<Place> places = new List<Place>();

    void OnEnable() { Apply(); }

    public void Apply()
    {
        if (pages.Count == 0) return;
        var maps = new LightmapData[pages.Count];
        bool directional = true;
        for (int i = 0; i < maps.Length; ++i)
        {
            maps[i] = new LightmapData { lightmapColor = pages[i].color, lightmapDir = pages[i].direction };
            directional = directional && pages[i].direction != null;
        }
        LightmapSettings.lightmapsMode = directional ? LightmapsMode.CombinedDirectional : LightmapsMode.NonDirectional;
        LightmapSettings.lightmaps = maps;
        foreach (Place place in places)
        {
            if (place.renderer == null) continue;
            place.renderer.lightmapIndex = place.page;
            place.renderer.lightmapScaleOffset = place.scaleOffset;
        }
    }
}

#if UNITY_EDITOR
public static class LumelImport
{
    [Serializable] class Map { public string file = ""; public int page = 0; public string map = ""; }
    [Serializable] class Node { public string name = ""; public int page = 0; public float[] scaleOffset = new float[4]; }
    [Serializable] class About { public Map[] maps = new Map[0]; public Node[] objects = new Node[0]; }

    [UnityEditor.MenuItem("Tools/Lumel/Apply lightmaps")]
    static void ApplyToSelection()
    {
        GameObject root = UnityEditor.Selection.activeGameObject;
        string path = UnityEditor.EditorUtility.OpenFilePanel("export.json of the lightmaps", Application.dataPath, "json");
        if (root == null || path == "" || !path.StartsWith(Application.dataPath))
        {
            Debug.LogError("Lumel: select the object of scene.glb, and an export.json inside of Assets");
            return;
        }
        string folder = "Assets" + System.IO.Path.GetDirectoryName(path).Substring(Application.dataPath.Length);
        About about = JsonUtility.FromJson<About>(System.IO.File.ReadAllText(path));
        LumelLightmaps target = root.GetComponent<LumelLightmaps>();
        if (target == null) target = root.AddComponent<LumelLightmaps>();
        target.pages.Clear();
        target.places.Clear();
        foreach (Map map in about.maps)
        {
            if (map.map != "flat" && map.map != "dir") continue;
            while (target.pages.Count <= map.page) target.pages.Add(new LumelLightmaps.Page());
            LumelLightmaps.Page page = target.pages[map.page];
            Texture2D texture = Import(folder + "/" + map.file, map.map == "dir");
            if (map.map == "dir") page.direction = texture; else page.color = texture;
            target.pages[map.page] = page;
        }
        var nodes = new Dictionary<string, Node>();
        foreach (Node node in about.objects) nodes[node.name] = node;
        foreach (Renderer renderer in root.GetComponentsInChildren<Renderer>(true))
        {
            // An importer may put the primitives of a node below it.
            Node node;
            Transform parent = renderer.transform.parent;
            if (!nodes.TryGetValue(renderer.name, out node) && (parent == null || !nodes.TryGetValue(parent.name, out node)))
                continue;
            target.places.Add(new LumelLightmaps.Place {
                renderer = renderer, page = node.page,
                scaleOffset = new Vector4(node.scaleOffset[0], node.scaleOffset[1], node.scaleOffset[2], node.scaleOffset[3]) });
        }
        target.Apply();
        UnityEditor.EditorUtility.SetDirty(target);
        Debug.Log("Lumel: " + target.pages.Count + " pages, " + target.places.Count + " renderers");
    }

    static Texture2D Import(string path, bool isDirection)
    {
        var importer = (UnityEditor.TextureImporter)UnityEditor.AssetImporter.GetAtPath(path);
        importer.textureType = isDirection ? UnityEditor.TextureImporterType.DirectionalLightmap
                                           : UnityEditor.TextureImporterType.Lightmap;
        importer.mipmapEnabled = false;
        importer.wrapMode = TextureWrapMode.Clamp;
        importer.maxTextureSize = 16384;
        importer.SaveAndReimport();
        return UnityEditor.AssetDatabase.LoadAssetAtPath<Texture2D>(path);
    }
}
#endif
